"""The jobs: plain functions from a warehouse and a request to a result. Know nothing of Prefect."""
